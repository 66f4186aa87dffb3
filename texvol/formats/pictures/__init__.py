"""Picture files through OpenImageIO: EXR, PNG, JPEG; depths; pictures inside HTML pages."""
