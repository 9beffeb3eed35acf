"""What the pages of studies have in common: letters and colours, drawings, templates."""
