"""The choices of the planner beside their alternatives; docs/measured/choices.md and planner.md."""
