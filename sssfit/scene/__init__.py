"""What kernels are applied to: pictures of irradiance, with depth and mask where they have them."""
