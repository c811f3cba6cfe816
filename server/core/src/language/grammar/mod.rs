//! From words to readings: what a sentence's clauses say.

pub(crate) mod aside;
pub(crate) mod ask;
pub(crate) mod attach;
pub(crate) mod attribute;
pub(crate) mod build;
pub(crate) mod copula;
pub(crate) mod correct;
pub(crate) mod cursor;
pub(crate) mod deictic;
pub(crate) mod figures;
pub(crate) mod generic;
pub(crate) mod label;
pub(crate) mod leads;
pub(crate) mod level;
pub(crate) mod locate;
pub(crate) mod measure;
pub(crate) mod naming;
pub(crate) mod noun_phrase;
pub(crate) mod parse;
pub(crate) mod pointed;
pub(crate) mod pointer;
pub(crate) mod presents;
pub(crate) mod relate;
pub(crate) mod repair;
pub(crate) mod route;
pub(crate) mod sentence;
