//! Picture differences for pullfocus: PSNR, SSIM, FLIP.
