"""OpenGL: contexts without a screen, shader programs, textures on the device, and the compositor.

Only this package and the window import moderngl or glfw. Every object here is made with a context that is passed to
it, and is released by its owner.
"""
