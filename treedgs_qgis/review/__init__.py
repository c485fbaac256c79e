"""The panel **Review trees**: a person's last word on each tree, kept in columns of its own."""
