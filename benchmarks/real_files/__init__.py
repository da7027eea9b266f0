"""Files that nobody here made, drawn as `topleft render` draws them; docs/measured/real_files.md."""
