//! Tests reading a struct that a later version has made longer. The interface has no such struct yet.

use super::*;

#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grown {
    struct_size: u32,
    first: u32,
    added: u64,
}

c_struct!(Grown, 8, added: 2);

fn grown(struct_size: u32, first: u32, added: u64) -> Grown {
    Grown {
        struct_size: CAMLUX_INITIALISED | struct_size,
        first,
        added,
    }
}

#[test]
fn a_struct_of_an_old_program_has_defaults_for_what_was_added() {
    let mut room = grown(8, 5, 6);
    // SAFETY: it points to enough memory.
    let read = unsafe { args::read(&raw const room) }.map_err(|failure| failure.message);
    assert_eq!(read, Ok(grown(8, 5, 2)));
    // SAFETY: as above.
    let written = unsafe { args::write(&raw mut room, || Ok(grown(16, 7, 8))) };
    assert!(written.is_ok());
    // The bytes behind an old program's struct are not changed.
    assert_eq!(room, grown(8, 7, 6));
    for bytes in [7, 9, 12] {
        room.struct_size = CAMLUX_INITIALISED | bytes;
        // SAFETY: as above.
        let is_read = unsafe { args::read(&raw const room) }.is_ok();
        assert_eq!(is_read, bytes >= 8, "{bytes}");
    }
}
