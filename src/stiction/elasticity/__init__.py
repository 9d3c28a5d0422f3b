"""Linear elasticity of the half-spaces: static stiffness and memory kernels."""
