//! A scene with fewer pixels, to be quick with.

use pullfocus_core::{Distance, Element, Frame, Picture, Plane, Result, Scene, Size, Window};

/// The scene with one pixel in `n` along each axis: colour is the mean of a block, distance that of the pixel in its middle,
/// since a mean of two distances is nobody's.
///
/// # Errors
/// [`pullfocus_core::Error::OutOfMemory`].
pub fn reduced(scene: &Scene, n: usize) -> Result<Scene> {
    let n = n.max(1);
    Ok(Scene {
        frame: frame(&scene.frame, n),
        base: element(&scene.base, n)?,
        foreground: scene.foreground.as_ref().map(|near| element(near, n)).transpose()?,
    })
}

fn size(size: Size, n: usize) -> Size {
    Size::new(size.width.div_ceil(n), size.height.div_ceil(n))
}

fn window(window: &Window, n: usize) -> Window {
    let part = |at: i32| at.div_euclid(n as i32);
    Window { x: part(window.x), y: part(window.y), size: size(window.size, n) }
}

fn frame(frame: &Frame, n: usize) -> Frame {
    Frame { display: window(&frame.display, n), data: window(&frame.data, n), ..*frame }
}

fn element(element: &Element, n: usize) -> Result<Element> {
    let picture = &element.picture;
    let colors = picture.colors.iter().map(|plane| means(plane, n)).collect::<Result<_>>()?;
    let alpha = picture.alpha.as_ref().map(|plane| means(plane, n)).transpose()?;
    let distance = match &element.distance {
        Distance::Depth { plane, decoding } => {
            Distance::Depth { plane: middles(plane, n, 1.0)?, decoding: *decoding }
        }
        // Diameters are in pixels.
        Distance::Coc(plane) => Distance::Coc(middles(plane, n, 1.0 / n as f32)?),
    };
    Ok(Element { picture: Picture { colors, alpha }, distance })
}

fn means(plane: &Plane, n: usize) -> Result<Plane> {
    let full = plane.size();
    let small = size(full, n);
    let mut out = Plane::filled(small, 0.0)?;
    for y in 0..small.height {
        let rows = n * y..full.height.min(n * (y + 1));
        let line = out.row_mut(y);
        for row in rows.clone() {
            for (sum, block) in line.iter_mut().zip(plane.row(row).chunks(n)) {
                *sum += block.iter().sum::<f32>() / (block.len() * rows.len()) as f32;
            }
        }
    }
    Ok(out)
}

fn middles(plane: &Plane, n: usize, factor: f32) -> Result<Plane> {
    let full = plane.size();
    let middle = |at: usize, length: usize| (n * at + n / 2).min(length - 1);
    Plane::from_fn(size(full, n), |x, y| factor * plane.at(middle(x, full.width), middle(y, full.height)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_means_and_distances_are_somebodys() {
        let size = Size::new(5, 3);
        let picture = Picture::opaque(vec![Plane::from_fn(size, |x, y| (x + 10 * y) as f32).unwrap()]);
        let distance = Distance::Coc(Plane::from_fn(size, |x, _| x as f32).unwrap());
        let scene = Scene::new(Frame::full(size), Element { picture, distance });
        let half = reduced(&scene, 2).unwrap();
        half.check().unwrap();
        assert_eq!((half.frame.data.size, half.frame.display.size), (Size::new(3, 2), Size::new(3, 2)));
        assert_eq!(half.base.picture.colors[0].row(0), [5.5, 7.5, 9.0]);
        assert_eq!(half.base.picture.colors[0].row(1), [20.5, 22.5, 24.0]);
        // In pixels half as many.
        assert_eq!(half.base.distance.plane().row(0), [0.5, 1.5, 2.0]);
        assert_eq!(reduced(&scene, 1).unwrap(), scene);
    }
}
