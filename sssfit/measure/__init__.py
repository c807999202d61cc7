"""How far a picture is from the true one, and what a kernel costs."""
