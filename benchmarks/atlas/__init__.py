"""Where each method fails; docs/measured/atlas.md."""
