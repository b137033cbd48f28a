"""Compiled kernels: arrays in, arrays and a status code out; nothing here imports the rest of recon."""
