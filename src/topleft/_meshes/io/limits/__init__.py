"""What a file may take: counted over all of it, and unpacked no further."""
