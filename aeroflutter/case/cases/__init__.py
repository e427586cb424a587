"""Built-in cases, one TOML file each."""
