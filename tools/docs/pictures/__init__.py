"""The pictures of docs/how-it-works.md, one module each."""
