"""Side force and aligning moment by the Magic Formula of three kinds, and .tir files of its coefficients."""
