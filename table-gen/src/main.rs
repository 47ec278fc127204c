//! Command-line interface.
use table_gen::{
    game::{Unwatched, Watch},
    spec::Spec,
    synthesis,
};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let spec = Spec::load(&args[0], &args[1..]).unwrap();
    let s = synthesis::synthesise(&spec, &|_| Box::new(Unwatched) as Box<dyn Watch>);
    match s {
        Err(e) => println!("{e}"),
        Ok(s) => {
            println!("abs {}", s.abstraction_cpu_s);
            for (n, l) in [
                ("C1", Some(&s.c1)),
                ("C2", s.c2.as_ref()),
                ("Hold", s.hold.as_ref()),
            ] {
                if let Some(l) = l {
                    println!(
                        "{n}: target {} win {} sweeps {} cpu {:.3} wall {:.3}",
                        l.target_cells, l.solution.winning, l.solution.sweeps, l.cpu_s, l.wall_s
                    );
                }
            }
            println!("{:?} MB", table_gen::usage::peak_rss_mb());
            let a = synthesis::abstraction(&spec, &s.grid).unwrap();
            use table_gen::abstraction::Abstraction;
            println!(
                "block {:?} ext {:?} {:?}",
                a.block(),
                a.extents(),
                a.block_extents()
            );
            if std::env::var("TRANS").is_ok() {
                println!("transitions {}", synthesis::count_transitions(&a));
            }
        }
    }
}
