"""Figures of the documentation that no single command draws."""
from PIL import Image
def draw_thumbnails(folder): return []
def draw_slabs(folder): return []
def draw_window(folder): return []
