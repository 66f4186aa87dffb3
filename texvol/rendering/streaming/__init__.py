"""Pictures of volumes that stay in a store: read, drawn and forgotten part by part, front to back."""
