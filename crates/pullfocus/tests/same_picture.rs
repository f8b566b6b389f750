//! The same picture from both devices; ignored where there is no adapter. `pullfocus-gpu`'s tests say how to name one.

#[cfg(feature = "gpu")]
mod same {
    use libtest_mimic::{Arguments, Trial};
    use pullfocus_core::{
        Aperture, Bokeh, Cancel, Distance, Element, Frame, Layering, Method, Picture, Plane, Preset, Report,
        Scene, Settings, Show, Size, Storage,
    };
    use pullfocus_gpu::{Choice, Host, adapters};
    use pullfocus_testkit::conformance::compare_pictures;
    use pullfocus_testkit::scenes;
    use std::sync::{Mutex, OnceLock, PoisonError};

    fn choice() -> Option<Choice> {
        let wanted = std::env::var("PULLFOCUS_TEST_ADAPTER").unwrap_or_default().to_lowercase();
        let usable = adapters().into_iter().filter(|info| info.unusable.is_none());
        let mut names = usable.map(|info| info.name);
        names.find(|name| name.to_lowercase().contains(&wanted)).map(Choice::Named)
    }

    fn with_host<T>(work: impl FnOnce(&mut Host) -> T) -> T {
        static HOST: OnceLock<Mutex<Host>> = OnceLock::new();
        let host = HOST.get_or_init(|| {
            let choice = choice().expect("an adapter: the test is ignored without");
            Mutex::new(Host::open(&choice).expect("the adapter opens"))
        });
        work(&mut host.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// A fence before a ramp with so many colours, alpha if wanted.
    fn scene(size: Size, colors: usize, alpha: bool) -> Scene {
        let mut scene = scenes::fence_over_ramp(size, -9.0, 14.0);
        let picture = &mut scene.base.picture;
        while picture.colors.len() < colors {
            picture.colors.push(scenes::noise(size, 0.0, 2.0, picture.colors.len() as u64));
        }
        picture.colors.truncate(colors);
        picture.alpha = alpha.then(|| scenes::ramp(size, 0.2, 1.0));
        scene
    }

    /// The same with a block in front of it.
    fn layered(size: Size, alpha: bool) -> Scene {
        let mut scene = scene(size, 3, alpha);
        let block = |x: usize, y: usize| x > size.width / 3 && x < size.width / 2 && y > size.height / 4;
        let cover = scenes::plane(size, |x, y| if block(x, y) { 1.0 } else { 0.0 });
        let colors = [0.9, 0.4, 0.1].map(|c| scenes::plane(size, |x, y| c * cover.at(x, y))).to_vec();
        scene.foreground = Some(Element {
            picture: Picture { colors, alpha: Some(cover) },
            distance: Distance::Coc(scenes::constant(size, -13.0)),
        });
        scene
    }

    /// Diffusion, and the aperture with a shape that is the same in front of focus and one that is not.
    fn every_layering() -> Vec<Settings> {
        by_diffusion().into_iter().chain(by_spreading()).collect()
    }

    fn by_spreading() -> Vec<Settings> {
        let shapes = [Aperture::DISC, Aperture { roundness: 0.3, squeeze: 1.4, ..Aperture::blades(5, 17.0) }];
        shapes
            .into_iter()
            .zip([Layering::default(), Layering::Background { layers: 2, threshold: 0.02 }])
            .flat_map(|(aperture, layering)| {
                let of = |layering| Settings {
                    layering,
                    aperture: aperture.clone(),
                    method: Method::Aperture,
                    ..Settings::default()
                };
                [of(Layering::Single), of(layering)]
            })
            .collect()
    }

    fn by_diffusion() -> [Settings; 4] {
        let of = |layering| Settings { layering, ..Settings::default() };
        [
            of(Layering::Single),
            of(Layering::Background { layers: 2, threshold: 0.02 }),
            Settings::preset(Preset::Preview),
            Settings::default(),
        ]
    }

    /// Half of what both may be from f64: each value within 1e-4 of the other, or of 0.05 where it is darker.
    const RELATIVE: f32 = 1e-4;
    const FLOOR: f32 = 0.05;
    /// The same with highlights: the CPU's table has rims within a 64th of a pixel, of lights up to 1 whose sprites cover three pixels or
    /// more.
    const OF_SPRITES: f32 = 5e-3;
    const FLOOR_OF_SPRITES: f32 = 1.0;

    fn check(name: &str, scene: &Scene) {
        check_with(name, scene, &every_layering());
    }

    fn check_with(name: &str, scene: &Scene, settings: &[Settings]) {
        for settings in settings {
            let [(by_cpu, cpu), (by_gpu, gpu)] = both(scene, settings);
            let name =
                format!("{name} with {:?}, {:?}, {:?}", settings.method, settings.layering, settings.show);
            compare_pictures(&name, &by_gpu, &by_cpu, RELATIVE, FLOOR);
            assert_eq!((gpu.layers, gpu.coc_range), (cpu.layers, cpu.coc_range), "{name}");
        }
    }

    /// By the CPU and by the GPU.
    fn both(scene: &Scene, settings: &Settings) -> [(Picture, Report); 2] {
        let cancel = Cancel::new();
        let [mut by_cpu, mut by_gpu] = [scene.clone(), scene.clone()];
        let cpu = pullfocus_cpu::Renderer::new().render(&mut by_cpu, None, settings, &cancel);
        let gpu = with_host(|host| host.render(&mut by_gpu, None, settings, &cancel));
        let (cpu, gpu) = (cpu.expect("the CPU renders"), gpu.expect("the GPU renders"));
        [(by_cpu.base.picture, cpu), (by_gpu.base.picture, gpu)]
    }

    fn pictures_of_any_planes() {
        for (colors, alpha) in
            [(3, false), (3, true), (1, true), (2, true), (1, false), (7, true), (8, false)]
        {
            check(&format!("{colors} colours, alpha {alpha}"), &scene(Size::new(150, 84), colors, alpha));
        }
    }

    fn pictures_of_any_size() {
        for size in
            [Size::new(1, 1), Size::new(1, 40), Size::new(57, 2), Size::new(300, 17), Size::new(64, 64)]
        {
            check(&size.to_string(), &scene(size, 3, true));
        }
    }

    /// Several levels, circles wider than the picture, and more rows than a host submits at a time.
    fn circles_of_any_size() {
        for (size, times) in
            [(Size::new(150, 84), 8.0), (Size::new(150, 84), 300.0), (Size::new(640, 130), 20.0)]
        {
            let mut scene = scene(size, 3, false);
            if let Distance::Coc(plane) = &mut scene.base.distance {
                plane.data_mut().iter_mut().for_each(|c| *c *= times);
            }
            check_with(&format!("circles {times} times as large"), &scene, &by_spreading());
        }
    }

    fn a_wide_frame_whose_fills_lie_on_a_coarser_grid() {
        let mut scene = scene(Size::new(160, 90), 3, false);
        scene.frame = Frame { pixel_aspect: 1.3, ..scene.frame };
        scene.frame.display.size = Size::new(3840, 2160);
        check("a part of a wide frame", &scene);
    }

    fn foregrounds() {
        for alpha in [false, true] {
            check("a foreground", &layered(Size::new(150, 84), alpha));
        }
        let mut sharp = layered(Size::new(60, 40), false);
        sharp.base.distance = Distance::Coc(scenes::constant(Size::new(60, 40), 0.0));
        check("a foreground before a picture in focus", &sharp);
    }

    fn each_layer_alone() {
        let numbers = 0..4;
        let shows: Vec<Show> = numbers.clone().map(Show::Layer).chain(numbers.map(Show::Matte)).collect();
        let alone = |settings: Settings| {
            shows.clone().into_iter().map(move |show| Settings { show, ..settings.clone() })
        };
        let every: Vec<Settings> = every_layering().into_iter().flat_map(alone).collect();
        check_with("a layer", &layered(Size::new(150, 84), true), &every);
        check_with("a layer of seven colours", &scene(Size::new(57, 31), 7, false), &every);
        let bokeh = Some(Bokeh { threshold: 1.5, ..Bokeh::default() });
        for settings in every {
            let settings = Settings { bokeh, ..settings };
            let scene = layered(Size::new(150, 84), true);
            let name = format!(
                "highlights with {:?}, {:?}, {:?}",
                settings.method, settings.layering, settings.show
            );
            let [by_cpu, by_gpu] = both(&scene, &settings).map(|(picture, _)| picture);
            compare_pictures(&name, &by_gpu, &by_cpu, OF_SPRITES, FLOOR_OF_SPRITES);
        }
    }

    fn half_storage_is_near() {
        let scene = scene(Size::new(150, 84), 3, true);
        for settings in every_layering() {
            let render = |storage| {
                let mut scene = scene.clone();
                with_host(|host| {
                    host.set_storage(storage);
                    let result = host.render(&mut scene, None, &settings, &Cancel::new());
                    host.set_storage(Storage::Full);
                    result.expect("it renders");
                });
                scene.base.picture
            };
            // f16 rounds by 5e-4, some ten times over, the disc's fields at ten times the size of their sum.
            compare_pictures("half", &render(Storage::Half), &render(Storage::Full), 5e-2, 0.5);
        }
    }

    fn a_failed_frame_leaves_no_memory_behind() {
        let scene = scene(Size::new(200, 120), 3, false);
        with_host(|host| {
            let cancelled = Cancel::new();
            cancelled.cancel();
            let mut kept = scene.clone();
            host.render(&mut kept, None, &Settings::default(), &Cancel::new()).expect("it renders");
            let before = host.bytes();
            for _ in 0..3 {
                let mut scene = scene.clone();
                // Cancelled in the middle: by then a part is recorded.
                let late = Cancel::new();
                let flag = late.clone();
                let raise = std::thread::spawn(move || {
                    std::thread::sleep(std::time::Duration::from_millis(5));
                    flag.cancel();
                });
                let result = host.render(&mut scene, None, &Settings::default(), &late);
                raise.join().expect("the flag is raised");
                if result.is_err() {
                    assert!(same_planes(&scene.base.picture, &self::scene(Size::new(200, 120), 3, false)));
                }
                assert!(host.bytes() <= before, "{} bytes after {before}", host.bytes());
            }
            let mut again = scene.clone();
            host.render(&mut again, None, &Settings::default(), &Cancel::new()).expect("it renders again");
            assert!(host.bytes() <= before && again.base.picture == kept.base.picture);
        });
    }

    fn same_planes(picture: &Picture, scene: &Scene) -> bool {
        let planes = |picture: &Picture| picture.planes().cloned().collect::<Vec<Plane>>();
        planes(picture) == planes(&scene.base.picture)
    }

    pub fn main() {
        let arguments = Arguments::from_args();
        let there = choice().is_some();
        let required = std::env::var("PULLFOCUS_TEST_GPU").is_ok_and(|value| value == "required");
        assert!(there || !required, "PULLFOCUS_TEST_GPU=required, and no adapter was found");
        let tests: [(&str, fn()); 8] = [
            ("circles_of_any_size", circles_of_any_size),
            ("pictures_of_any_planes", pictures_of_any_planes),
            ("pictures_of_any_size", pictures_of_any_size),
            (
                "a_wide_frame_whose_fills_lie_on_a_coarser_grid",
                a_wide_frame_whose_fills_lie_on_a_coarser_grid,
            ),
            ("foregrounds", foregrounds),
            ("each_layer_alone", each_layer_alone),
            ("half_storage_is_near", half_storage_is_near),
            ("a_failed_frame_leaves_no_memory_behind", a_failed_frame_leaves_no_memory_behind),
        ];
        let trials = tests.map(|(name, test)| {
            let run = move || {
                test();
                Ok(())
            };
            Trial::test(name, run).with_ignored_flag(!there)
        });
        libtest_mimic::run(&arguments, trials.into()).exit();
    }
}

#[cfg(feature = "gpu")]
fn main() {
    same::main();
}

#[cfg(not(feature = "gpu"))]
fn main() {}
