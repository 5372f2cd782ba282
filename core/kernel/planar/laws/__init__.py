"""The control laws, one file each, behind `interface`."""
