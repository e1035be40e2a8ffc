// Height of a light over a plane that rounding of either may make up, for each component of the normal. A lamp that is mounted on a
// surface lights what is before it: for its rays and for its RSM the surface is not there.
const LIGHT_IN_PLANE: f32 = 12.0 * 5.9604645e-8;
