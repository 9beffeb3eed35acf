"""YAML to validated, frozen models; errors name file, line, key and remedy."""
