"""What the user describes, frozen and in SI: links, guides, gears, inputs, loads; the TOML reader, the units of a file, the checks."""
