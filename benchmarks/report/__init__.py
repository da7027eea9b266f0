"""How records are shown, and the interface of studies."""
