"""Pictures by several processes, on one machine or on a cluster: each draws a convex block of the box."""
