// SPDX-License-Identifier: Apache-2.0
// As much of Unity as NeedleInTissue.cs uses, along one axis.
namespace UnityEngine {
public struct Vector3 {
  public float Z;
  public static float Dot(Vector3 a, Vector3 b) { return a.Z * b.Z; }
  public static Vector3 operator -(Vector3 a) { return new Vector3 { Z = -a.Z }; }
  public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3 { Z = a.Z - b.Z }; }
  public static Vector3 operator *(float a, Vector3 b) { return new Vector3 { Z = a * b.Z }; }
}
public class Transform { public Vector3 position, forward; }
public class Rigidbody {
  public Vector3 Force;
  public void AddForceAtPosition(Vector3 force, Vector3 position) { Force = force; }
}
public class MonoBehaviour {
  public Transform transform = new Transform();
  public bool enabled = true;
}
public static class Time { public static float fixedDeltaTime = 1e-3f; }
public static class Debug { public static void LogError(string message, object context) { System.Console.Error.WriteLine(message); } }
}
