// paper: Bare cone, constant friction per length, constant cutting force; PVA phantom at 3 mm/s.
// Written by needleforce export, version 0.2.0: export it again instead of editing it.
// SI units. Depth + inwards from the surface: subtract the fit's contact_depth. Force + opposes insertion.
// Use: new Insertion(gel.Layers);
// Reference: source paper (force model of needle insertion into a PVA phantom), sec. 2.1-2.4
// Doubt: reduced modulus: chosen so that the force is 0.2101 N at 3.237 mm; with the stated 116 kPa it
//   implies a Poisson ratio of 0.115 (0 to 0.42 within two standard deviations of force and depth), where a
//   hydrogel has about 0.5
// Doubt: half angle: the bevel angle of 15 degrees read as the half angle of a cone, which doubles the
//   bluntness of the tip
// Doubt: needle: 14.1 GPa is an effective modulus of unknown origin, steel has about 200 GPa; solid or
//   hollow is not stated
// Doubt: contact: beyond 2.05 mm the contact is wider than the needle; see the preset physical
// Doubt: friction: the foundation formula lacks a 1/b and the friction coefficient is not given, so the
//   measured value is used
public static class gel {
  public static readonly Needleforce.Layer[] Layers = {
    new Needleforce.Layer {
      Top = 0.0,  // m, where layer 1 begins below the undeformed surface
      Stiffness = new Needleforce.Law("cone") {
        { "reduced_modulus", 117546.06040021202 },  // Pa, reduced modulus of needle and tissue
        { "half_angle", 0.2617993877991494 },  // rad, angle between the needle's axis and the generator of the cone
      },
      Puncture = new Needleforce.Law("puncture_depth") {
        { "depth", 0.003237 },  // m, depth of the tip at puncture; 0 is a surface without resistance
      },
      Friction = new Needleforce.Law("coulomb") {
        { "per_length", 18.6 },  // N/m, friction force per embedded length while sliding
        { "presliding", 2e-05 },  // m, travel that takes the friction from nothing to sliding
        { "dimple_ratio", 0.0 },  // 1, share of the puncture depth at which the surface stays: 0 undeformed, 1 deformed
      },
      Cutting = new Needleforce.Law("constant_cutting") {
        { "force", 0.0776 },  // N, cutting force while the tip advances in fresh tissue
        { "unloading", 2e-05 },  // m, travel away from the deepest cut over which the force falls to zero
      },
      Relaxation = new Needleforce.Law("no_relaxation") {
      },
    },
  };
}
