//! Decides the switches of a module: sets its specialisation constants, and removes what they leave out. So a kernel binds what its
//! permutation needs, and drivers compile no dead code.

use std::borrow::Cow;

/// Opcodes and decorations of SPIR-V.
mod op {
    pub const EXT_INST: u32 = 12;
    pub const ENTRY_POINT: u32 = 15;
    pub const CONSTANT_TRUE: u32 = 41;
    pub const CONSTANT_FALSE: u32 = 42;
    pub const SPEC_CONSTANT_TRUE: u32 = 48;
    pub const SPEC_CONSTANT_FALSE: u32 = 49;
    pub const FUNCTION: u32 = 54;
    pub const FUNCTION_PARAMETER: u32 = 55;
    pub const FUNCTION_END: u32 = 56;
    pub const FUNCTION_CALL: u32 = 57;
    pub const VARIABLE: u32 = 59;
    pub const LOAD: u32 = 61;
    pub const STORE: u32 = 62;
    pub const ACCESS_CHAIN: u32 = 65;
    pub const DECORATE: u32 = 71;
    pub const VECTOR_SHUFFLE: u32 = 79;
    pub const COMPOSITE_EXTRACT: u32 = 81;
    pub const COMPOSITE_INSERT: u32 = 82;
    pub const IMAGE_FETCH: u32 = 95;
    pub const IMAGE_READ: u32 = 98;
    pub const IMAGE_WRITE: u32 = 99;
    pub const LOGICAL_OR: u32 = 166;
    pub const LOGICAL_AND: u32 = 167;
    pub const LOGICAL_NOT: u32 = 168;
    pub const CONTROL_BARRIER: u32 = 224;
    pub const ATOMIC_STORE: u32 = 228;
    pub const PHI: u32 = 245;
    pub const LOOP_MERGE: u32 = 246;
    pub const SELECTION_MERGE: u32 = 247;
    pub const LABEL: u32 = 248;
    pub const BRANCH: u32 = 249;
    pub const BRANCH_CONDITIONAL: u32 = 250;
    pub const SWITCH: u32 = 251;
    pub const RETURN_VALUE: u32 = 254;
    pub const RAY_QUERY_INITIALIZE: u32 = 4473;
    pub const RAY_QUERY_CONFIRM: u32 = 4476;
    pub const SPEC_ID: u32 = 1;
    pub const BINDING: u32 = 33;
}

pub(super) struct Specialised {
    pub words: Vec<u32>,
    /// The bindings that are left.
    pub bindings: Vec<u32>,
}

type Instruction<'w> = Cow<'w, [u32]>;

/// A set of ids.
struct Ids(Vec<bool>);

impl Ids {
    fn insert(&mut self, id: u32) -> bool {
        !std::mem::replace(&mut self.0[id as usize], true)
    }

    fn has(&self, id: u32) -> bool {
        self.0[id as usize]
    }

    /// Everything that is reached from `first`.
    fn reached(bound: usize, first: u32, mut next: impl FnMut(u32, &mut Vec<u32>)) -> Ids {
        let mut reached = Ids(vec![false; bound]);
        let mut open = vec![first];
        while let Some(id) = open.pop() {
            if reached.insert(id) {
                next(id, &mut open);
            }
        }
        reached
    }
}

fn opcode(instruction: &[u32]) -> u32 {
    instruction[0] & 0xffff
}

fn instructions(mut words: &[u32]) -> impl Iterator<Item = &[u32]> {
    std::iter::from_fn(move || {
        let length = (*words.first()? >> 16) as usize;
        let (instruction, rest) = words.split_at_checked(length.max(1))?;
        words = rest;
        Some(instruction)
    })
}

/// The ids that an instruction of a function takes, apart from types, labels and functions.
fn operands(i: &[u32]) -> impl Iterator<Item = u32> {
    let all = i.len();
    let (from, to) = match opcode(i) {
        op::FUNCTION | op::FUNCTION_PARAMETER | op::FUNCTION_END | op::VARIABLE => (0, 0),
        op::LABEL | op::BRANCH | op::SELECTION_MERGE | op::LOOP_MERGE => (0, 0),
        op::BRANCH_CONDITIONAL | op::SWITCH | op::RETURN_VALUE => (1, 2),
        op::STORE => (1, 3),
        op::IMAGE_WRITE | op::ATOMIC_STORE | op::CONTROL_BARRIER => (1, all),
        op::RAY_QUERY_INITIALIZE | op::RAY_QUERY_CONFIRM => (1, all),
        op::LOAD | op::COMPOSITE_EXTRACT => (3, 4),
        op::VECTOR_SHUFFLE | op::COMPOSITE_INSERT => (3, 5),
        op::FUNCTION_CALL => (4, all),
        op::EXT_INST => (5, all),
        _ => (3, all),
    };
    // A mask is no id.
    let mask = match opcode(i) {
        op::IMAGE_FETCH | op::IMAGE_READ => 5,
        _ => usize::MAX,
    };
    let places = from.min(all)..to.min(all);
    places
        .filter(move |&place| place != mask)
        .map(|place| i[place])
}

struct Function<'w> {
    id: u32,
    instructions: Vec<Instruction<'w>>,
}

/// `words` with each switch on or off; its SpecId is its place in the list.
pub(super) fn specialise(words: &[u32], is_on: &[bool]) -> Specialised {
    let (header, rest) = words.split_at(5);
    let bound = header[3] as usize;
    let all: Vec<&[u32]> = instructions(rest).collect();
    let start = all.iter().position(|i| opcode(i) == op::FUNCTION);
    let (declared, bodies) = all.split_at(start.unwrap_or(all.len()));

    let mut known: Vec<Option<bool>> = vec![None; bound];
    let mut variables = Ids(vec![false; bound]);
    let mut entry = 0;
    for i in declared {
        match opcode(i) {
            op::DECORATE if i[2] == op::SPEC_ID => {
                known[i[1] as usize] = Some(is_on[i[3] as usize])
            }
            op::CONSTANT_TRUE => known[i[2] as usize] = Some(true),
            op::CONSTANT_FALSE => known[i[2] as usize] = Some(false),
            op::VARIABLE => _ = variables.insert(i[2]),
            op::ENTRY_POINT => entry = i[2],
            _ => {}
        }
    }
    let mut functions: Vec<Function> = bodies
        .split_inclusive(|i| opcode(i) == op::FUNCTION_END)
        .map(|body| decided(body, &mut known))
        .collect();
    let called = Ids::reached(bound, entry, |id, open| {
        let function = functions.iter().find(|function| function.id == id);
        let instructions = function.iter().flat_map(|f| &f.instructions);
        let calls = instructions.filter(|i| opcode(i) == op::FUNCTION_CALL);
        open.extend(calls.map(|i| i[3]));
    });
    functions.retain(|function| called.has(function.id));
    let kept = || functions.iter().flat_map(|function| &function.instructions);
    let mut used = Ids(vec![false; bound]);
    for id in kept().flat_map(|i| operands(i)) {
        used.insert(id);
    }
    let is_unused = |id: u32| variables.has(id) && !used.has(id);

    let mut words = header.to_vec();
    let mut bindings = Vec::new();
    for i in declared {
        match opcode(i) {
            op::DECORATE if i[2] == op::SPEC_ID || is_unused(i[1]) => {}
            op::VARIABLE if is_unused(i[2]) => {}
            op::SPEC_CONSTANT_TRUE | op::SPEC_CONSTANT_FALSE => {
                let value = match known[i[2] as usize] {
                    Some(true) => op::CONSTANT_TRUE,
                    _ => op::CONSTANT_FALSE,
                };
                words.extend([3 << 16 | value, i[1], i[2]]);
            }
            op::ENTRY_POINT => {
                let is_end = |word: &u32| word.to_le_bytes().contains(&0);
                let name = i[3..].iter().position(is_end).unwrap_or_default();
                let (point, interface) = i.split_at(4 + name);
                let interface: Vec<u32> = interface
                    .iter()
                    .copied()
                    .filter(|&id| !is_unused(id))
                    .collect();
                let length = (point.len() + interface.len()) as u32;
                words.push(length << 16 | op::ENTRY_POINT);
                words.extend_from_slice(&point[1..]);
                words.extend(interface);
            }
            opcode => {
                if opcode == op::DECORATE && i[2] == op::BINDING {
                    bindings.push(i[3]);
                }
                words.extend_from_slice(i);
            }
        }
    }
    for i in kept() {
        words.extend_from_slice(i);
    }
    Specialised { words, bindings }
}

/// A function without the branches that its switches leave out.
fn decided<'w>(body: &[&'w [u32]], known: &mut [Option<bool>]) -> Function<'w> {
    let bound = known.len();
    let mut all: Vec<Instruction> = Vec::with_capacity(body.len());
    for &i in body {
        let of = |place: usize| known[i[place] as usize];
        let value = match opcode(i) {
            op::LOGICAL_OR => match (of(3), of(4)) {
                (Some(false), Some(false)) => Some(false),
                (Some(true), _) | (_, Some(true)) => Some(true),
                _ => None,
            },
            op::LOGICAL_AND => match (of(3), of(4)) {
                (Some(true), Some(true)) => Some(true),
                (Some(false), _) | (_, Some(false)) => Some(false),
                _ => None,
            },
            op::LOGICAL_NOT => of(3).map(|value| !value),
            op::BRANCH_CONDITIONAL => of(1),
            _ => None,
        };
        match (opcode(i), value, all.last().map(|i| opcode(i))) {
            (op::BRANCH_CONDITIONAL, Some(is_taken), Some(op::SELECTION_MERGE)) => {
                all.pop();
                let target = if is_taken { i[2] } else { i[3] };
                all.push(Cow::Owned(vec![2 << 16 | op::BRANCH, target]));
            }
            (op::LOGICAL_OR | op::LOGICAL_AND | op::LOGICAL_NOT, ..) => {
                known[i[2] as usize] = value;
                all.push(Cow::Borrowed(i));
            }
            _ => all.push(Cow::Borrowed(i)),
        }
    }
    // Blocks that are reached.
    let mut starts: Vec<(u32, usize)> = Vec::new();
    for (place, i) in all.iter().enumerate() {
        if opcode(i) == op::LABEL {
            starts.push((i[1], place));
        }
    }
    let first = starts.first().map_or(0, |start| start.0);
    let reached = Ids::reached(bound, first, |label, open| {
        let start = starts.iter().find(|start| start.0 == label);
        for i in all[start.map_or(all.len(), |start| start.1 + 1)..]
            .iter()
            .take_while(|i| ![op::LABEL, op::FUNCTION_END].contains(&opcode(i)))
        {
            match opcode(i) {
                op::BRANCH | op::SELECTION_MERGE => open.push(i[1]),
                op::LOOP_MERGE => open.extend([i[1], i[2]]),
                op::BRANCH_CONDITIONAL => open.extend([i[2], i[3]]),
                op::SWITCH => open.extend(i[2..].iter().step_by(2)),
                _ => {}
            }
        }
    });
    let mut is_reached = true;
    all.retain(|i| {
        match opcode(i) {
            op::LABEL => is_reached = reached.has(i[1]),
            op::FUNCTION_END => is_reached = true,
            _ => {}
        }
        is_reached
    });
    let mut needed = Ids(vec![false; bound]);
    for i in all.iter_mut().filter(|i| opcode(i) == op::PHI) {
        let pairs = i[3..].chunks(2).filter(|pair| reached.has(pair[1]));
        let pairs: Vec<u32> = pairs.flatten().copied().collect();
        let head = (pairs.len() as u32 + 3) << 16 | op::PHI;
        *i = Cow::Owned([&[head, i[1], i[2]], &pairs[..]].concat());
        for id in pairs {
            needed.insert(id);
        }
    }
    // naga loads at the start of a function what any branch of it needs.
    let mut kept = Vec::with_capacity(all.len());
    for i in all.into_iter().rev() {
        let is_pure = matches!(opcode(&i), op::LOAD | op::ACCESS_CHAIN);
        if is_pure && !needed.has(i[2]) {
            continue;
        }
        for id in operands(&i) {
            needed.insert(id);
        }
        kept.push(i);
    }
    kept.reverse();
    Function {
        id: body[0][2],
        instructions: kept,
    }
}
