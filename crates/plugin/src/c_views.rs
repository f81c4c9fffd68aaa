//! Converts signals and diagrams to borrowed C structures, and back.
#![allow(unsafe_code, reason = "pointers of the other side become slices here")]

use crate::abi::{self, SignalColumn, Text, borrow_array};
#[cfg(feature = "load")]
use crate::diagram::DiagramLayerRole;
use crate::diagram::{Diagram, DiagramLayer, DiagramLayerShape};
use crate::signal::Signal;

/// Lends a signal. Its columns differ in length only by mistake; the rest is then left out.
pub(crate) fn to_c_column(signal: &Signal) -> SignalColumn {
    SignalColumn {
        name: Text::new(signal.name),
        unit: Text::new(signal.unit),
        time: signal.time.as_ptr(),
        values: signal.values.as_ptr(),
        len: signal.time.len().min(signal.values.len()),
    }
}

/// Calls `work` with the signals of columns.
///
/// # Safety
/// `columns` is null, or points to `count` columns. They and what they point to live as long as the call.
pub(crate) unsafe fn with_signals<T>(
    columns: *const SignalColumn,
    count: usize,
    work: impl FnOnce(Vec<Signal>) -> T,
) -> T {
    // SAFETY: as the caller promises; so below.
    let columns = unsafe { borrow_array(columns, count) };
    // SAFETY: see above.
    let text = |text: Text| unsafe { text.to_str_lossy() };
    let names: Vec<_> = columns.iter().map(|column| (text(column.name), text(column.unit))).collect();
    let signals = columns.iter().zip(&names).map(|(column, (name, unit))| Signal {
        name,
        unit,
        // SAFETY: see above.
        time: unsafe { borrow_array(column.time, column.len) },
        // SAFETY: see above.
        values: unsafe { borrow_array(column.values, column.len) },
    });
    work(signals.collect())
}

/// Lends a diagram. Columns differ in length only by mistake; the rest is then left out.
pub(crate) fn with_c_diagram<T>(diagram: &Diagram, work: impl FnOnce(&abi::Diagram) -> T) -> T {
    let layers: Vec<_> = diagram.layers.iter().map(to_c_layer).collect();
    work(&abi::Diagram {
        title: Text::new(diagram.title),
        axes: diagram.axes.map(Text::new),
        ranges: diagram.ranges,
        layers: layers.as_ptr(),
        count: layers.len(),
    })
}

fn to_c_layer(layer: &DiagramLayer) -> abi::DiagramLayer {
    let len = layer.x.len().min(layer.y.len());
    let band = layer.shape == DiagramLayerShape::Band;
    abi::DiagramLayer {
        name: Text::new(layer.name),
        shape: layer.shape as u32,
        role: layer.role as u32,
        x: layer.x.as_ptr(),
        y: layer.y.as_ptr(),
        upper: if band { layer.upper.as_ptr() } else { std::ptr::null() },
        len: if band { len.min(layer.upper.len()) } else { len },
    }
}

/// Calls `work` with a diagram of the other side. Unknown shapes are lines.
///
/// # Safety
/// All that is pointed to lives as long as the call.
#[cfg(feature = "load")]
pub(crate) unsafe fn with_diagram<T>(diagram: &abi::Diagram, work: impl FnOnce(&Diagram) -> T) -> T {
    // SAFETY: as the caller promises; so below.
    let text = |text: Text| unsafe { text.to_str_lossy() };
    // SAFETY: see above.
    let lent = unsafe { borrow_array(diagram.layers, diagram.count) };
    let (title, axes) = (text(diagram.title), diagram.axes.map(text));
    let names: Vec<_> = lent.iter().map(|layer| text(layer.name)).collect();
    let layers = lent.iter().zip(&names).map(|(layer, name)| DiagramLayer {
        name,
        shape: DiagramLayerShape::ALL.get(layer.shape as usize).copied().unwrap_or(DiagramLayerShape::Line),
        role: DiagramLayerRole::ALL.get(layer.role as usize).copied().unwrap_or(DiagramLayerRole::Other),
        // SAFETY: see above.
        x: unsafe { borrow_array(layer.x, layer.len) },
        // SAFETY: see above.
        y: unsafe { borrow_array(layer.y, layer.len) },
        // SAFETY: see above; of what is no band it is null.
        upper: unsafe { borrow_array(layer.upper, layer.len) },
    });
    let axes = [&*axes[0], &*axes[1]];
    let layers = layers.collect();
    work(&Diagram { title: &title, axes, ranges: diagram.ranges, layers })
}
