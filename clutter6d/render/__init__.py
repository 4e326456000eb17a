"""Pictures: stills, contact sheets and videos of scenes and assets."""
