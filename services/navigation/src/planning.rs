//! Planning in a sketch (paper 001, III-C; paper 004, III-A).
