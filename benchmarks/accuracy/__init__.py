"""Time beside error of every method, peer and pure twin; docs/measured/accuracy.md."""
