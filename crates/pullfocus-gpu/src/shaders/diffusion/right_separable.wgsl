fn right_side(first: Lane, at: u32) -> Val { return v_make(first, Lane(0.0)); }
