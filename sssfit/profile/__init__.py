"""Diffuse reflectance profiles: the record, its file, and its integrals over pixels and lines."""

from sssfit.profile.record import FORMAT, Profile, full_kernel, is_profile_file

__all__ = ["FORMAT", "Profile", "full_kernel", "is_profile_file"]
