"""The gallery: its entries, volumes, pictures and page."""
