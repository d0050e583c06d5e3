//! Columns of text: few texts that repeat.

use std::collections::HashMap;

/// Texts as numbers into a dictionary.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct TextColumn {
    pub codes: Vec<u32>,
    pub dictionary: Vec<String>,
    index: HashMap<String, u32>,
}

impl TextColumn {
    pub(super) fn push(&mut self, word: &str) {
        let code = self.code(word);
        self.codes.push(code);
    }

    /// Pushes a word `times` times.
    pub(super) fn push_many(&mut self, word: &str, times: usize) {
        let code = self.code(word);
        self.codes.extend(std::iter::repeat_n(code, times));
    }

    fn code(&mut self, word: &str) -> u32 {
        // Neighbouring rows mostly carry the same word.
        if let Some(last) = self.codes.last()
            && self.dictionary[*last as usize] == word
        {
            return *last;
        }
        if let Some(code) = self.index.get(word) {
            return *code;
        }
        let code = self.dictionary.len() as u32;
        self.dictionary.push(word.to_owned());
        self.index.insert(word.to_owned(), code);
        code
    }

    pub(super) fn append(&mut self, other: &Self) {
        let map: Vec<u32> = other.dictionary.iter().map(|w| self.code(w)).collect();
        self.codes.extend(other.codes.iter().map(|c| map[*c as usize]));
    }

    pub(super) fn get(&self, row: usize) -> &str {
        self.codes.get(row).and_then(|c| self.dictionary.get(*c as usize)).map_or("", String::as_str)
    }
}
