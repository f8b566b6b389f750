//! Ways to cut the partitioned solver's work, sorted by time.

use super::session::{Case, Session, ms, storage_name};
use super::solvers::{one_step, planes};
use crate::speed::cases::{circle, integrators};
use crate::table::Table;
use anyhow::Result;
use pullfocus::{Diffusion, Solver};
use pullfocus_gpu::{Storage, Tuning};

/// Every combination for real systems, or for complex ones.
fn combinations(complex: bool) -> Vec<Tuning> {
    let chunks: &[u32] = if complex { &[4, 8, 12, 16] } else { &[8, 12, 16, 20, 24, 32] };
    let mut all = vec![];
    for &chunk in chunks {
        for threads in [128, 256, 512] {
            for columns in [2, 4, 8] {
                let tuning = Tuning { threads, columns, ..Tuning::default() };
                all.push(if complex {
                    Tuning { chunk_complex: chunk, ..tuning }
                } else {
                    Tuning { chunk_real: chunk, ..tuning }
                });
            }
        }
    }
    all
}

/// Tries all and prints tables.
pub fn run(session: &mut Session) -> Result<()> {
    let [_, _, (_, disc)] = integrators();
    let cases: [(&str, Diffusion, bool); 2] =
        [("backward Euler, 1 step", one_step(Solver::Lu), false), ("disc", disc, true)];
    for (width, height) in [(1920, 1080), (3840, 2160)] {
        let size = session.size(width, height);
        if let Err(why) = session.may(size) {
            println!("{size}: {why}\n");
            continue;
        }
        let (planes, circle) = (planes(size), circle(size, 50.0)?);
        for storage in [Storage::Full, Storage::Half] {
            for (name, settings, complex) in &cases {
                let mut times = vec![];
                for tuning in combinations(*complex) {
                    session.host.set_tuning(tuning);
                    let label = format!("tune {name} {storage:?}");
                    let case = Case { label: &label, planes: &planes, circle: &circle, settings, storage };
                    if let Ok(run) = session.diffusion(&case)? {
                        times.push((tuning, run.seconds, run.copy));
                    }
                }
                session.host.set_tuning(Tuning::default());
                let of = combinations(*complex).len();
                println!("{size}, {name}, {}, {} of {of}\n", storage_name(storage), times.len());
                println!("{}", table(times, *complex));
            }
        }
    }
    Ok(())
}

/// Combinations by time, seconds and the copy's beside them.
fn table(mut times: Vec<(Tuning, f64, f64)>, complex: bool) -> String {
    times.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut table = Table::new(["chunk", "threads", "columns", "ms", "times the copy", ""]);
    for (tuning, seconds, copy) in times {
        let chunk = if complex { tuning.chunk_complex } else { tuning.chunk_real };
        let default = if tuning == Tuning::default() { "default" } else { "" };
        table.row([
            chunk.to_string(),
            tuning.threads.to_string(),
            tuning.columns.to_string(),
            ms(seconds),
            format!("{:.2}", seconds / copy),
            default.to_owned(),
        ]);
    }
    table.to_markdown()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_among_them_and_the_fastest_comes_first() {
        for complex in [false, true] {
            let all = combinations(complex);
            assert!(all.contains(&Tuning::default()));
            let times = all.iter().enumerate().map(|(i, t)| (*t, 1.0 / (i + 1) as f64, 1.0)).collect();
            let text = table(times, complex);
            let last = all.last().unwrap();
            let chunk = if complex { last.chunk_complex } else { last.chunk_real };
            let first = text.lines().nth(2).unwrap();
            assert!(first.starts_with(&format!("| {chunk} | 512 | 8 |")), "{first}");
            assert_eq!(text.matches("default").count(), 1);
        }
    }
}
