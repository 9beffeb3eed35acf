"""A recorded flight's inputs through the controller again."""
