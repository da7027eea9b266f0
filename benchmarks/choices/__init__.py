"""What the planner chooses beside what it could have; docs/measured/choices.md and planner.md."""
