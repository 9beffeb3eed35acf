"""``python -m sitl_shim``."""

from sitl_shim.cli import main

main()
