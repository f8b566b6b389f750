//! Picture files for pullfocus: OpenEXR, PNG, JPEG, TIFF, HDR, PFM and sequences.
