"""The materials that ship with sssfit, one TOML file each."""
