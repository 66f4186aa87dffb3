"""Contents of 3D textures: integrated slabs, values, lit samples, and volumes of half the resolution."""
