//! VPLs in another order.

use crate::{
    Device, Result,
    passes::{gather::ListedVpls, vpl::VplLists},
    vulkan::{Buffer, Readback, Recorder},
};

/// Puts a light's VPLs, matte and glossy, into an order that a seed decides.
pub(super) fn shuffle(
    device: &Device,
    vpls: &VplLists,
    ListedVpls { first, lengths }: ListedVpls,
    seed: u64,
) -> Result<()> {
    let lists = [
        (Some(&vpls.matte), lengths.matte),
        (vpls.glossy.as_ref(), lengths.glossy),
    ];
    for (list, length) in lists {
        let Some(list) = list else { continue };
        let order = shuffled(length, seed);
        let mut readback = Readback::new(device, list.shape)?;
        let mut texels = readback.pixels(list)?.to_vec();
        let texels_per_layer = texels.len() / list.shape.layer_count() as usize;
        for layer in texels.chunks_exact_mut(texels_per_layer) {
            let of_light = &mut layer[first as usize..][..length as usize];
            let before = of_light.to_vec();
            for (texel, from) in of_light.iter_mut().zip(&order) {
                *texel = before[*from as usize];
            }
        }
        let buffer = Buffer::upload(device, "shuffled VPLs", &texels)?;
        let mut recorder = Recorder::new(device, 1)?;
        recorder.copy_to_image(&buffer, list);
        recorder.submit()?;
    }
    Ok(())
}

/// The numbers below a count, each once.
fn shuffled(count: u32, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count).collect();
    fastrand::Rng::with_seed(seed).shuffle(&mut order);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_once_and_seldom_in_its_place() {
        let mut order = shuffled(1000, 7);
        assert!(order != shuffled(1000, 8));
        let in_place = order.iter().zip(0..).filter(|(a, b)| **a == *b).count();
        assert!(in_place < 10, "{in_place}");
        order.sort_unstable();
        assert_eq!(order, (0..1000).collect::<Vec<u32>>());
    }
}
