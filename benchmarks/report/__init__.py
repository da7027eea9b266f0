"""How records are shown, and what every study has to offer."""
