// SPDX-License-Identifier: Apache-2.0
// A component for the object at the needle's tip, its z axis along the needle. `surface` is where the tissue begins, its z axis out of the
// tissue. The force acts on the Rigidbody, if there is one, and is here for a haptic device or a display. Needs Needleforce.cs, the C library
// in Assets/Plugins, and a model written by `needleforce export fit.json --name gel --language c#`.
using Needleforce;
using UnityEngine;

public class NeedleInTissue : MonoBehaviour {
  public Transform surface;
  public Rigidbody body;
  public double maxForce = 3.0;     // [N]
  public double staleAfter = 0.05;  // [s] without a valid depth, then the force falls to zero
  public double force;              // [N] + opposes insertion
  public string status = "";
  Insertion insertion;
  Guard guard;

  void OnEnable() {
    try {
      insertion = new Insertion(gel.Layers);
      guard = new Guard(insertion, new Numbers { { "max_force", maxForce }, { "stale_after", staleAfter }, { "fall_time", staleAfter } });
    } catch (NeedleforceException error) {  // the library is missing, or the model is refused
      status = error.Message;
      Debug.LogError(error.Message, this);
      enabled = false;
    }
  }
  void OnDisable() {
    if (guard != null) guard.Dispose();
    if (insertion != null) insertion.Dispose();
    guard = null;
    insertion = null;
    force = 0.0;
  }
  // Unity's default is 50 Hz: set Project Settings > Time > Fixed Timestep to 0.001 or 0.002.
  void FixedUpdate() {
    double depth = Depth(), dt = Time.fixedDeltaTime;
    Output output = double.IsNaN(depth) ? guard.Miss(dt) : guard.Step(depth, No.Velocity, dt);
    force = output.Force;
    status = output.Sample.Status + ", " + output.Did;
    if (body != null) body.AddForceAtPosition(-(float)force * transform.forward, transform.position);
  }
  // Along the needle, from where its axis meets the surface; no number where it is within 10 degrees of parallel to the surface.
  double Depth() {
    float slope = Vector3.Dot(-surface.forward, transform.forward);
    if (slope < 0.17f) return double.NaN;
    return Vector3.Dot(surface.position - transform.position, surface.forward) / slope;
  }
}
