//! Charts with a logarithmic height, as SVG.

use anyhow::{Result, anyhow};
use plotters::prelude::*;

/// One line of a chart.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Points; a height of 0 or below is left out.
    pub points: Vec<(f64, f64)>,
}

/// Two panels beside each other, with the same lines in the same colours.
#[derive(Debug, Clone)]
pub struct Chart {
    /// Title over each panel.
    pub titles: [&'static str; 2],
    /// What runs to the right.
    pub across: &'static str,
    /// Powers of two run to the right.
    pub doubling: bool,
    /// Lines of each panel.
    pub panels: [Vec<Series>; 2],
}

const COLORS: [RGBColor; 6] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(90, 90, 90),
];

impl Chart {
    /// The chart as the text of an SVG file.
    pub fn to_svg(&self) -> Result<String> {
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, (1100, 460)).into_drawing_area();
            self.draw(&root).map_err(|error| anyhow!("cannot draw the chart: {error}"))?;
        }
        Ok(svg)
    }

    fn draw<B: DrawingBackend>(
        &self,
        root: &DrawingArea<B, plotters::coord::Shift>,
    ) -> std::result::Result<(), Box<dyn std::error::Error>>
    where
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let place = |(x, y): (f64, f64)| (if self.doubling { x.log2() } else { x }, y.log10());
        for ((area, series), title) in root.split_evenly((1, 2)).iter().zip(&self.panels).zip(self.titles) {
            let lines: Vec<Vec<(f64, f64)>> = series
                .iter()
                .map(|s| s.points.iter().filter(|p| p.1 > 0.0).map(|&p| place(p)).collect())
                .collect();
            let points = || lines.iter().flatten();
            let range = |of: fn(&(f64, f64)) -> f64| {
                let low = points().map(of).fold(f64::INFINITY, f64::min);
                let high = points().map(of).fold(f64::NEG_INFINITY, f64::max);
                if low < high { low..high } else { 0.0..1.0 }
            };
            let heights = range(|p| p.1);
            let mut chart = ChartBuilder::on(area)
                .caption(title, ("sans-serif", 18))
                .margin(12)
                .x_label_area_size(44)
                .y_label_area_size(64)
                .build_cartesian_2d(range(|p| p.0), heights.start.floor()..heights.end.ceil())?;
            let doubling = self.doubling;
            chart
                .configure_mesh()
                .x_desc(self.across)
                .x_label_formatter(&|x| if doubling { format!("{:.0}", x.exp2()) } else { format!("{x:.0}") })
                .y_label_formatter(&|y| format!("1e{y:.0}"))
                .light_line_style(WHITE)
                .draw()?;
            for (i, (line, name)) in lines.into_iter().zip(series.iter().map(|s| &s.name)).enumerate() {
                let style = COLORS[i % COLORS.len()].stroke_width(2);
                chart
                    .draw_series(LineSeries::new(line, style))?
                    .label(name)
                    .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
            }
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerRight)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.3))
                .draw()?;
        }
        root.present()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_holds_its_lines_and_names() {
        let series = |name: &str| Series {
            name: name.to_owned(),
            points: vec![(1.0, 1.0), (2.0, 0.1), (4.0, 0.0), (8.0, 1e-4)],
        };
        let chart = Chart {
            titles: ["left", "right"],
            across: "size",
            doubling: true,
            panels: [vec![series("first")], vec![series("first"), series("second")]],
        };
        let svg = chart.to_svg().unwrap();
        assert!(svg.trim_end().ends_with("</svg>"));
        for text in ["left", "right", "second", "polyline"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
