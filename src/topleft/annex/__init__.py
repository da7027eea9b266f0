"""For programs beside the library: what they need besides public names. A name that changes stands in the changelog."""
