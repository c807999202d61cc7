"""What kernels are applied to: pictures of irradiance and what lies under each pixel."""
