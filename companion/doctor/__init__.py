"""What `companion doctor` reads of a computer, and how it judges that."""
