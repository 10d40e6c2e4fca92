//! Draws the waveforms of bits over the last scans.

use ratatui_core::layout::Rect;

use super::LadderPanel;
use super::scan_history::PastScan;
use crate::ScreenStyle;
use crate::style::{PaneArea, truncate_text};

/// Number of rows of the complete waveforms: a heading and one row per bit.
pub(super) fn wave_height(panel: &LadderPanel) -> usize {
    1 + shown_bits(panel).len()
}

/// Symbol indices of inputs, outputs and relays, in symbol order.
fn shown_bits(panel: &LadderPanel) -> Vec<usize> {
    panel.machine.symbols_of(|kind| kind.is_bit()).collect()
}

/// Draws as many rows as fit into the pane.
pub(super) fn draw_wave(panel: &LadderPanel, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let Rect { width, height, .. } = paper.area;
    let bits = shown_bits(panel);
    let symbols = panel.machine.symbols();
    let name = |bit: usize| symbols.get(bit).map_or("", |s| s.name.as_str());
    let widest = bits.iter().map(|bit| name(*bit).chars().count()).max().unwrap_or(0).clamp(4, 14);
    let columns = usize::from(width).saturating_sub(widest + 2);
    // The newest scan is in the last column. If a column shows several scans, it begins at a multiple of
    // their number.
    let zoom = panel.zoom.max(1);
    let kept = panel.machine.past();
    let old = kept.len().saturating_sub((columns + 1).saturating_mul(zoom));
    let past: Vec<&PastScan> = kept.skip(old).filter(|moment| moment.has_run()).collect();
    let groups: Vec<_> =
        past.chunk_by(|a, b| a.scan().div_ceil(zoom as u64) == b.scan().div_ceil(zoom as u64)).collect();
    let groups = groups.get(groups.len().saturating_sub(columns)..).unwrap_or(&[]);
    let each = if zoom == 1 { "a scan a column".to_owned() } else { format!("{zoom} scans a column") };
    let more = if bits.len() >= usize::from(height) { ", w: others" } else { "" };
    paper.put_heading(0, &format!("Waveform, {each}{more}"), look);
    for (row, bit) in (1..height).zip(bits.into_iter().skip(panel.first_bit)) {
        paper.put_right(
            u16::try_from(widest).unwrap_or(0),
            row,
            &truncate_text(name(bit), widest),
            look.on(panel.machine.get(bit) != 0),
        );
        let mut x = u16::try_from(widest + 2).unwrap_or(0);
        for group in groups {
            let level = |moment: &&&PastScan| moment.get(bit) != 0;
            let high = group.iter().filter(level).count();
            let (sign, style) = match high {
                0 => ("▁", look.dead()),
                n if n == group.len() => ("▔", look.live()),
                _ => ("▒", look.live()),
            };
            x = paper.put(x, row, sign, style);
        }
    }
}
