"""Control laws for planar hands, one module each; `interface` selects the law."""
