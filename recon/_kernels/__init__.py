"""Array in, array out, status codes: the compiled kernels. Nothing here validates, raises, or imports anything of ours."""
