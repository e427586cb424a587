"""Time marching: the exact engine, Houbolt's scheme, and DOP853 for smooth springs."""
