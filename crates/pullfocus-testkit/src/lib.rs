//! Unpublished: f64 references, analytic scenes and the conformance suite.
