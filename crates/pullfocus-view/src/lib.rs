//! The interactive program of pullfocus.
