# A second opinion on main bounds of rounding.py, by Gappa: each part, up to a line of dashes, is a file of it.
# A rounding multiplies by 1 + d, |d| <= u; 1b-24 is 2^-24. What is exact has one letter.

# Rows in float32 (raster/triangles_float.c): e + i dx - k dy within 5.01 u XY.
f = e * (1 + d0); g = a * (1 + d1); h = b * (1 + d2);
v = (f + i * g) * (1 + d3);
{ e in [-1,1] /\ a in [-1,1] /\ b in [-1,1] /\ i in [0,1] /\ k in [0,1]
 /\ d0 in [-1b-24,1b-24] /\ d1 in [-1b-24,1b-24] /\ d2 in [-1b-24,1b-24] /\ d3 in [-1b-24,1b-24]
 -> |(v - k * h) - (e + i * a - k * b)| <= 10260b-35 }
(v - k * h) - (e + i * a - k * b) -> e * d0 + i * (a * d1) + (f + i * g) * d3 - k * (b * d2);
----
# Rows in float64 (raster/single_float.c): P = dy x, Q = dx y, I = i dx, K = k dy; within 11.1 u XY.
p = P * (1 + d1) * (1 + d2) * (1 + d3); q = Q * (1 + d4) * (1 + d5) * (1 + d6);
e = (p - q) * (1 + d7); i = I * (1 + d4) * (1 + d8); v = (e + i) * (1 + d9); k = K * (1 + d1);
{ P in [-1,1] /\ Q in [-1,1] /\ I in [-1,1] /\ K in [-1,1] /\ P - Q in [-1,1] /\ P - Q + I in [-1,1]
 /\ d1 in [-1b-53,1b-53] /\ d2 in [-1b-53,1b-53] /\ d3 in [-1b-53,1b-53] /\ d4 in [-1b-53,1b-53]
 /\ d5 in [-1b-53,1b-53] /\ d6 in [-1b-53,1b-53] /\ d7 in [-1b-53,1b-53] /\ d8 in [-1b-53,1b-53]
 /\ d9 in [-1b-53,1b-53] -> |(v - k) - (P - Q + I - K)| <= 11366b-63 }
(v - k) - (P - Q + I - K) -> P * ((1 + d1) * (1 + d2) * (1 + d3) - 1) - Q * ((1 + d4) * (1 + d5) * (1 + d6) - 1)
  + (P - Q) * d7 + (p - q - (P - Q)) * d7 + I * ((1 + d4) * (1 + d8) - 1) + (P - Q + I) * d9
  + (e + i - (P - Q + I)) * d9 - K * d1;
p - q - (P - Q) -> P * ((1 + d1) * (1 + d2) * (1 + d3) - 1) - Q * ((1 + d4) * (1 + d5) * (1 + d6) - 1);
e + i - (P - Q + I) -> p - q - (P - Q) + (p - q) * d7 + I * ((1 + d4) * (1 + d8) - 1);
----
# The setup of small boxes in float32, from points (raster/triangles_float.c): within 5.1 u XY.
p = P * (1 + d1) * (1 + d2); q = Q * (1 + d3) * (1 + d4); e = (p - q) * (1 + d5);
{ P in [-1,1] /\ Q in [-1,1] /\ P - Q in [-1,1]
 /\ d1 in [-1b-24,1b-24] /\ d2 in [-1b-24,1b-24] /\ d3 in [-1b-24,1b-24] /\ d4 in [-1b-24,1b-24]
 /\ d5 in [-1b-24,1b-24] -> |e - (P - Q)| <= 5222b-34 }
e - (P - Q) -> (P - Q) * d5 + (P * ((1 + d1) * (1 + d2) - 1) - Q * ((1 + d3) * (1 + d4) - 1)) * (1 + d5);
----
# A rounded edge function (exact/sign.c, pixels/weights_exact.c): within 7.1 u of a box.
l = L * (1 + d1) * (1 + d2) * (1 + d3); r = R * (1 + d4) * (1 + d5) * (1 + d6); e = (l - r) * (1 + d7);
{ L in [-1,1] /\ R in [-1,1] /\ L - R in [-1,1]
 /\ d1 in [-1b-53,1b-53] /\ d2 in [-1b-53,1b-53] /\ d3 in [-1b-53,1b-53] /\ d4 in [-1b-53,1b-53]
 /\ d5 in [-1b-53,1b-53] /\ d6 in [-1b-53,1b-53] /\ d7 in [-1b-53,1b-53] -> |e - (L - R)| <= 7270b-63 }
e - (L - R) -> (L - R) * d7
  + (L * ((1 + d1) * (1 + d2) * (1 + d3) - 1) - R * ((1 + d4) * (1 + d5) * (1 + d6) - 1)) * (1 + d7);
----
# Where an edge of areas enters a row (area/ramp.c): x0 + t dx / dy within 2^-36 px.
@r = float<ieee_64, ne>;
s = S * (1 + d); x = r(x0 + r(t * s));
{ x0 in [0,1] /\ t in [-33554432,33554432] /\ t * S in [-16384,16384] /\ d in [-1b-53,1b-53]
 -> |x - (x0 + t * S)| <= 1b-36 }
t * s -> t * S * (1 + d);
x - (x0 + t * S) -> (x - (x0 + r(t * s))) + (r(t * s) - t * s) + t * S * d;
----
# Depth by a plane (vertex/setup.c): A = d1 y2, B = d2 y1, the part of x or of y within 8.1 u r.
s = (A * (1 + a1) * (1 + a2) - B * (1 + b1) * (1 + b2)) * (1 + c) * (1 + i) * (1 + m);
{ A in [-1,1] /\ B in [-1,1] /\ A - B in [-1,1] /\ y in [-1,1]
 /\ a1 in [-1b-53,1b-53] /\ a2 in [-1b-53,1b-53] /\ b1 in [-1b-53,1b-53] /\ b2 in [-1b-53,1b-53]
 /\ c in [-1b-53,1b-53] /\ i in [-1b-53,1b-53] /\ m in [-1b-53,1b-53] /\ n in [-1b-53,1b-53]
 -> |s * y * (1 + n) - (A - B) * y| <= 8294b-63 }
s * y * (1 + n) - (A - B) * y -> ((A - B) * ((1 + c) * (1 + i) * (1 + m) * (1 + n) - 1)
  + (A * ((1 + a1) * (1 + a2) - 1) - B * ((1 + b1) * (1 + b2) - 1)) * (1 + c) * (1 + i) * (1 + m) * (1 + n)) * y;
