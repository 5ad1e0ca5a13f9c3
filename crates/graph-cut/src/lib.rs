//! Maximum flow (Boykov & Kolmogorov 2004) and moves on Markov random fields with Potts interaction
//! (Boykov, Veksler & Zabih 2001), on grids and on general graphs.
