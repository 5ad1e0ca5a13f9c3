<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/3.0" xmlns:bldg="http://www.opengis.net/citygml/building/3.0" xmlns:con="http://www.opengis.net/citygml/construction/3.0" xmlns:dem="http://www.opengis.net/citygml/relief/3.0" xmlns:gen="http://www.opengis.net/citygml/generics/3.0" xmlns:gml="http://www.opengis.net/gml/3.2" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengis.net/citygml/building/3.0 http://schemas.opengis.net/citygml/building/3.0/building.xsd http://www.opengis.net/citygml/relief/3.0 http://schemas.opengis.net/citygml/relief/3.0/relief.xsd http://www.opengis.net/citygml/generics/3.0 http://schemas.opengis.net/citygml/generics/3.0/generics.xsd" gml:id="city-model">
 <gml:name>mesh, tile 1_1</gml:name>
 <gml:boundedBy>
  <gml:Envelope srsName="urn:ogc:def:crs:EPSG::7415" srsDimension="3">
   <gml:lowerCorner>85020 446020 100.9663</gml:lowerCorner>
   <gml:upperCorner>85042 446042 102.3431</gml:upperCorner>
  </gml:Envelope>
 </gml:boundedBy>
 <cityObjectMember>
  <dem:ReliefFeature gml:id="terrain-1-1-relief">
   <dem:lod>1</dem:lod>
   <dem:reliefComponent>
    <dem:TINRelief gml:id="terrain-1-1">
     <dem:lod>1</dem:lod>
     <dem:tin>
      <gml:TriangulatedSurface gml:id="terrain-1-1_tin">
       <gml:patches>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85020 446020 101.2908 85042 446020 100.9663 85020 446042 102.3431 85020 446020 101.2908</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85042 446020 100.9663 85042 446042 102.1349 85020 446042 102.3431 85042 446020 100.9663</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
       </gml:patches>
      </gml:TriangulatedSurface>
     </dem:tin>
    </dem:TINRelief>
   </dem:reliefComponent>
  </dem:ReliefFeature>
 </cityObjectMember>
</CityModel>
