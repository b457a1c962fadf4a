//! Monte Carlo localization in a sketch (paper 001, III-A).
