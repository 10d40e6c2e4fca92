//! The results of a check as data, text, HTML page, table and JUnit file.

pub(crate) mod check_report;
pub(crate) mod html_page;
pub(crate) mod junit;
pub(crate) mod summary_table;
pub(crate) mod waveform_svg;
