"""Evidence sheets: one small picture a tree that shows why its diameter is believed, or why there is none."""
