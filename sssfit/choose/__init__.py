"""The cheapest kernel for a material, a view and a tolerance."""
