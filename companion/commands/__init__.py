"""What each command of the command line does: from what was asked for to what a person is told."""
