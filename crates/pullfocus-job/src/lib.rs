//! What the programs of pullfocus share. Options ([`options`]), from a command line or a settings file ([`config`]), become a job
//! ([`job`]): which frames ([`frames`]), which lens at each of them ([`camera`], [`shot`]), which [`settings`]. [`load`] reads a
//! frame, [`storage`] writes it. [`track`] is a shot's lens alone.

pub mod camera;
pub mod config;
pub mod draw;
pub mod failure;
pub mod frames;
pub mod job;
pub mod load;
pub mod options;
pub mod purpose;
pub mod settings;
pub mod shot;
pub mod storage;
pub mod threads;
pub mod track;
pub mod values;
pub mod yielding;
