"""Makes a page that shows a map in three dimensions: one HTML file that needs neither server nor network (scripts/make_page)."""
