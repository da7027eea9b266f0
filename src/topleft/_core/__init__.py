"""Arrays in, arrays out: triangles and polygons as masks, ids, depth and colours; knows no mesh, camera or file."""
